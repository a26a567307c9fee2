"""The commands of the command line, one file each: their options, and the printing of results."""

import os

# Before numpy is imported. Matrices here are small, and bayestouch shares its work over processes: threads of the
# numerical library beside these wait for each other. With one thread the results do not depend on the number of cores.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
