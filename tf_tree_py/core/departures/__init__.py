"""
Transforms on their way out: which of many samples go, and when.

Over what they go, who calls knows: a topic, or a link to another machine. Bytes are made in
``arrivals.wire``.
"""
