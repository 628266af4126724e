"""The character for game engines in other languages: a runtime in C (`c/`), and the files that go with it."""
