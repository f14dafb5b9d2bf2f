"""The protocol: what may be judged, how, and where every judgement is written down (docs/protocol.md)."""
