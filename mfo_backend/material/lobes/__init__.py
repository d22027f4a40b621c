# SPDX-License-Identifier: Apache-2.0
"""The lobes of the Principled BSDF and their terms: microfacets, Fresnel, thin film, sheen, diffuse."""
