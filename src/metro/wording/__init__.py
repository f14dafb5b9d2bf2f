"""The wording of what the loop states: it knows JSON and numbers, and no model, effect or fit."""
