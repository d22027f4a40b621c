# SPDX-License-Identifier: Apache-2.0
"""What each rule of the search, the judging and the certainties is worth: the same fits with it and without it."""
