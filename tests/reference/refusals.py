"""A test case that knows how refusals look."""

import unittest

from tandem_reference.errors import Refused


class RefusalCase(unittest.TestCase):
    def refused(self, rule, call, *arguments):
        """The call must be refused by a rule."""
        with self.assertRaises(Refused) as caught:
            call(*arguments)
        self.assertEqual(caught.exception.rule, rule, str(caught.exception))
