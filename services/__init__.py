"""What the robot does: each package below is one service, or what runs and checks them."""
