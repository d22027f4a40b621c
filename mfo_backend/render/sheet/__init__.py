# SPDX-License-Identifier: Apache-2.0
"""Several pictures of one material as one picture: side by side on a contact sheet."""
