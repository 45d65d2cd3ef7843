"""What an MJCF file says of joints beside masses: taken over, or refused by name."""
