"""The house as shapes: floors, walls with their holes, furniture by kind, marks. Pure; knows no viewer."""
