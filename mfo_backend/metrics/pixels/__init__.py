# SPDX-License-Identifier: Apache-2.0
"""Which pixels are compared, and arithmetic on planes of them."""
