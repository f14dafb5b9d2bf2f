"""Engagement, chip thickness and force law: the mechanistic model of milling forces."""
