# SPDX-License-Identifier: Apache-2.0
"""What every layer speaks of: parameters, images, results, status and errors. Imports nothing of ours."""
