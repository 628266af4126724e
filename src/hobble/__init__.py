"""Hobble: from motion capture to a character controller that limps the way the body would."""
