"""The stage commands: each reads its inputs, calls the rooms, and writes its outputs atomically."""
