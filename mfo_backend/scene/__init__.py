# SPDX-License-Identifier: Apache-2.0
"""Files of a job: scene XML, images. Knows no renderer."""
