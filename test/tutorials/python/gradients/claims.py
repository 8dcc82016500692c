"""Checked claims for the tutorials."""
import sys


def claim(holds, what):
    """Prints the claim, and ends the program with status 1 if it does not hold."""
    print("yes:" if holds else "NO:", what)
    if not holds:
        sys.exit(1)
