# SPDX-License-Identifier: Apache-2.0
"""What a second picture tells, proposed or drawn, and whether a picture under a moved lamp is named."""
