# SPDX-License-Identifier: Apache-2.0
"""What of this machine works, and how to mend what does not."""
