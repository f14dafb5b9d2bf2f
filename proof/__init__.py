"""The proof of the loop: batches with sealed hidden effects, run blind, then compared with the truth."""
