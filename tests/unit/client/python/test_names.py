# SPDX-License-Identifier: Apache-2.0
"""Programs that use the former names still work."""
import pytest

import warmfront

BEFORE = ["Aborted", "AlreadyExists", "Cancelled", "DataLoss", "DeadlineExceeded", "FailedPrecondition", "Internal",
          "InvalidArgument", "NotFound", "PermissionDenied", "ResourceExhausted", "Unauthenticated", "Unavailable",
          "Unimplemented"]


@pytest.mark.parametrize("name", BEFORE)
def test_exceptions(name):
    error = getattr(warmfront, name)
    assert error is getattr(warmfront, name + "Error") and error.__name__ == name + "Error"
    assert issubclass(error, warmfront.WarmfrontError) and name in warmfront.__all__


def test_timeouts(daemon):
    assert warmfront.Patience is warmfront.Timeouts
    with warmfront.connect(daemon.address, patience=warmfront.Patience(call=20)) as client:
        assert client._connection.timeouts.call == 20
