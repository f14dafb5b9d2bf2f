"""What a robot arm is known by: load tests, tip force, walls, clocks; shared by the robot's observables."""
