import doctest

import rewards

UNDOCUMENTED = ("Schedule", "RewardTable", "CRAWL", "RECOVERY", "STOCK")


def test_usage_example_of_the_docstring_runs():
    result = doctest.testmod(rewards)
    assert result.attempted >= 5
    assert result.failed == 0


def test_everything_exported_exists_and_is_documented():
    for name in rewards.__all__:
        assert hasattr(rewards, name)
        assert name in UNDOCUMENTED or getattr(rewards, name).__doc__
