"""One HTML file that a person opens, reads and plays with."""
