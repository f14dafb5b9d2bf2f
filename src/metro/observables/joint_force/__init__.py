"""The force on the tip by the torques of the joints.

``TABLES``: the tables that ``observe`` may write.
"""

NAME = "joint_force"
OF_LOGS = ("joint_log", "joint_log_curve", "joint_log_terms", "payload_joints", "payload_course")
TABLES = (
    "joint_torque",
    "tool_force",
    "joint_force_refused",
    "joint_friction",
    "joint_friction_curve",
    *OF_LOGS,
)
