"""The log's vocabulary: one frozen class a topic, its codec, its version."""
