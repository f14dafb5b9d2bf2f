"""Kinematics, statics and stiffness of an arm; forces from joint torques."""
