# SPDX-License-Identifier: GPL-3.0-or-later
"""What only Cycles can tell about a scene, rendered or baked by it: worlds as panoramas, surfaces as textures."""
