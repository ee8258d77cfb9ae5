"""Replay regression: what each service said to recorded inputs, it still says.

`python -m tests.replay` says what has changed. A change that is wanted becomes the reference with
`python -m tests.replay bless [CASE...]`, which gives the recorded inputs to the services again and
stores what they say. `python -m tests.replay record [CASE...]` records the inputs anew first.
"""
