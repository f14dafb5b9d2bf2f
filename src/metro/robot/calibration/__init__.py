"""Calibration of an arm by measured poses: corrections of its geometry, effects on its joints, proof."""
