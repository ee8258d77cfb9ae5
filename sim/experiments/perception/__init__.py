"""How well and how fast perception works, on pictures whose truth is known."""
