"""The schema of logs: one frozen class per topic, with codecs and versions."""
