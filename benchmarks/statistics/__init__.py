"""How often statistics over seeds are right: synthetic studies with known answers."""
