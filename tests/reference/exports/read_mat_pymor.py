"""What `twin export A.h5 --format mat -o A.mat` wrote as an LTI model of pyMOR.

python read_mat_pymor.py A.mat
"""

from __future__ import annotations

import sys

from pymor.core.logger import set_log_levels
from pymor.models.iosys import LTIModel

set_log_levels({"pymor": "WARN"})


def lti_model(path):
    return LTIModel.from_mat_file(str(path))


def transfer_function(path, s):
    """(p, m) at a complex frequency s [rad/s]."""
    return lti_model(path).transfer_function.eval_tf(s)


if __name__ == "__main__":
    model = lti_model(sys.argv[1])
    print(model)
    print(abs(model.transfer_function.eval_tf(1j / 3600.0)))  # at a period of 2 pi hours
