# SPDX-License-Identifier: Apache-2.0
"""The job folder: request in, progress and result out, cancel."""
