"""What a policy is made of, and where one is read from."""
