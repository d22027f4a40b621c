# SPDX-License-Identifier: Apache-2.0
"""What Mitsuba needs of this machine: libLLVM, variant, plugin libraries, caches and memory."""
