"""`python -m fingers_robot`."""

import sys

from fingers_robot.cli.main import main

sys.exit(main())
