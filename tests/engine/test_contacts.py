"""Records of the contact table: their fields mean the same in compiled kernels and in Python."""

import numpy as np
import pytest

from deadwood_engine.contacts import CONTACT, OLD_CONTACT
from deadwood_engine.cores import CORE
from deadwood_engine.rolling import ROLLING
from deadwood_engine.scratch import Scratch
from deadwood_engine.way import SUMMARY, WAY


@pytest.mark.parametrize("kind", [CONTACT, OLD_CONTACT, CORE, ROLLING, SUMMARY, WAY])
def test_no_field_hides_behind_a_method(kind):
    """In Python a record's own methods come before its fields: ``c.any`` would be a function, not a lever."""
    assert not set(kind.names) & set(dir(np.record))


def test_a_worker_has_contacts_as_records():
    scratch = Scratch.allocate(8, 3, 1, None)
    for table, kind in ((scratch.contacts, CONTACT), (scratch.old_contacts, OLD_CONTACT), (scratch.spare, CONTACT)):
        assert isinstance(table, np.recarray)
        assert table.dtype.fields == kind.fields
    assert len(scratch.spare) == 1
