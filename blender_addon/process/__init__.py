# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs beside Blender: started, read line by line, ended. No bpy here."""
