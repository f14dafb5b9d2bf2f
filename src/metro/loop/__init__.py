"""The closed loop: noise, joint fits, the search for effects, the verdict."""
