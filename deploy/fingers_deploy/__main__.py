"""`python -m fingers_deploy`."""

import sys

from fingers_deploy.cli.main import main

sys.exit(main())
