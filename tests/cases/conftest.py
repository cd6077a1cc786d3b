"""What tests of cases share with those of recordings: files understood in the test's own process."""

from tests.recordings.conftest import understood_here as understood_here
