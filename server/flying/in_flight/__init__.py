"""What is laid, certified and ordered while the vehicle flies: guided ways, and a plan that is taken up."""
