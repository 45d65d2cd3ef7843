"""Public measured data sets as logs; the user downloads them, nothing is included."""
