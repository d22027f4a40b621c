# SPDX-License-Identifier: Apache-2.0
"""Pictures of a scene and their pull-backs: who renders them, how they are summed, what they cost."""
