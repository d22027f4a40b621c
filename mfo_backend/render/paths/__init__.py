# SPDX-License-Identifier: Apache-2.0
"""Light paths over the target, recorded once for any material."""
