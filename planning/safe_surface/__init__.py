"""The surface that no line may go below: the model dilated by the ball (R, H), and smoothed."""
