# SPDX-License-Identifier: Apache-2.0
"""The Mitsuba BSDF `by_ray`: a surface that is something else to other rays, as nodes of Blender's Light Path have it.

Choose the variant before importing this. Nested BSDFs are named by the rays that meet them (`RAYS`); `scattered` is
for all that have none of their own, and `behind` for all that meet the back. Integrators write the number of a ray's
kind into `si.duv_dy.y`.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false
# pyright: reportIncompatibleMethodOverride=false

from __future__ import annotations

from collections.abc import Iterator
from functools import reduce
from operator import or_
from typing import Any

import drjit as dr
import mitsuba as mi

from .mapped_normal import is_behind
from .ray_kinds import RAYS, SCATTERED

PLUGIN_NAME = "by_ray"


class ByRay(mi.BSDF):
    """Asks the BSDF of a ray's kind."""

    tells_rays = True  # for `ray_kinds.is_by_ray`, which needs no variant

    def __init__(self, props: mi.Properties) -> None:
        mi.BSDF.__init__(self, props)
        self._looks = {number: props[name] for number, name in enumerate(RAYS) if name in props}
        self._behind = props.get("behind", None)
        looks = [*self._looks.values(), *filter(None, [self._behind])]
        self.m_components = [look.flags(k) for look in looks for k in range(look.component_count())]
        self.m_flags = reduce(or_, self.m_components)

    @property
    def absorbing(self) -> Any:
        """The material whose volume is inside, None where there is none."""
        return next((look.absorbing for look in self._looks.values() if getattr(look, "absorbing", None)), None)

    def traverse(self, callback: Any) -> None:
        """Show the nested BSDFs."""
        for number, look in self._looks.items():
            callback.put(RAYS[number], look, mi.ParamFlags.Differentiable)
        if self._behind is not None:
            callback.put("behind", self._behind, mi.ParamFlags.Differentiable)

    def eval(self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: Any = True) -> Any:
        """f_r |cos|, RGB."""
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: Any = True) -> Any:
        """Density of `sample` per solid angle."""
        return self.eval_pdf(ctx, si, wo, active)[1]

    def eval_pdf(
        self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: Any = True
    ) -> tuple[Any, Any]:
        """`eval` and `pdf`."""
        value, density = mi.Color3f(0), mi.Float(0)
        for look, here in self._of(si, active):
            own, likely = look.eval_pdf(ctx, si, wo, here)
            value, density = dr.select(here, mi.Color3f(own), value), dr.select(here, likely, density)
        return value, density

    def sample(
        self,
        ctx: mi.BSDFContext,
        si: mi.SurfaceInteraction3f,
        sample1: Any,
        sample2: mi.Point2f,
        active: Any = True,
    ) -> tuple[mi.BSDFSample3f, Any]:
        """A direction and value over density."""
        bs, weight = dr.zeros(mi.BSDFSample3f), mi.Color3f(0)
        for look, here in self._of(si, active):
            drawn, own = look.sample(ctx, si, sample1, sample2, here)
            bs, weight = dr.select(here, drawn, bs), dr.select(here, mi.Color3f(own), weight)
        return bs, weight

    def eval_null_transmission(self, si: mi.SurfaceInteraction3f, active: Any = True) -> Any:
        """Share of light that passes unchanged."""
        value = mi.Color3f(0)
        for look, here in self._of(si, active):
            value = dr.select(here, mi.Color3f(look.eval_null_transmission(si, here)), value)
        return value

    def eval_diffuse_reflectance(self, si: mi.SurfaceInteraction3f, active: Any = True) -> Any:
        """That of what scattered rays meet."""
        return self._looks[SCATTERED].eval_diffuse_reflectance(si, active)

    def emitted(self, si: mi.SurfaceInteraction3f, active: Any, **of_light: Any) -> mi.Color3f:
        """The surface's own light, as of scattered rays: all see the same."""
        look = self._looks[SCATTERED]
        if hasattr(look, "emitted"):
            return look.emitted(si, active, **of_light)
        return 1 - mi.Color3f(look.eval_null_transmission(si, active))

    def to_string(self) -> str:
        """Short description."""
        return f"ByRay[{', '.join(RAYS[number] for number in self._looks)}]"

    def _of(self, si: mi.SurfaceInteraction3f, active: Any) -> Iterator[tuple[Any, mi.Bool]]:
        """The BSDFs, and where each is asked."""
        others = mi.Bool(active)
        if self._behind is not None:
            here = others & is_behind(si)
            others &= ~here
            yield self._behind, here
        for number, look in self._looks.items():
            if number != SCATTERED:
                here = others & (si.duv_dy.y == number)
                others &= ~here
                yield look, here
        yield self._looks[SCATTERED], others


def register() -> None:
    """Make `by_ray` known to Mitsuba in the current variant."""
    mi.register_bsdf(PLUGIN_NAME, ByRay)
