"""The paper's procedures: three parameters of each joint from one log."""
