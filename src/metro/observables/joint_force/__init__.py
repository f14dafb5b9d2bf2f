"""The force on the tip by the torques of the joints.

``TABLES``: the tables that ``observe`` may write.
"""

NAME = "joint_force"
TABLES = ("joint_torque", "tool_force", "joint_force_refused", "joint_friction", "joint_friction_curve")
