# SPDX-License-Identifier: Apache-2.0
"""What lies in a job folder and what it asks for: names, request.json, and the files it names."""
