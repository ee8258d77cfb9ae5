"""The "lit" camera shader: SAPIEN's unlit "trivial" one with sun, sky light and highlights added.

On a CPU the default shader of SAPIEN takes 13 s to its first picture, the unlit one under a
second. The unlit source is read from the installed package and our lines are put into it at run
time, so the interface blocks always fit the installed version.
"""

from __future__ import annotations

import tempfile
from functools import lru_cache
from pathlib import Path

import sapien

VERTEX_OUTPUTS = """
layout(location = 3) out vec3 worldNormal;
layout(location = 4) out vec3 worldPosition;
void main() {
  worldNormal = mat3(objectTransformBuffer.modelMatrix) * normal;
  worldPosition = (objectTransformBuffer.modelMatrix * vec4(position, 1)).xyz;
"""

FRAGMENT_INPUTS = """
layout(location = 3) in vec3 worldNormal;
layout(location = 4) in vec3 worldPosition;

vec3 shade(vec3 albedo) {
  vec3 n = dot(worldNormal, worldNormal) > 1e-8 ? normalize(worldNormal) : vec3(0, 0, 1);
  vec3 eye = normalize(cameraBuffer.viewMatrixInverse[3].xyz - worldPosition);
  float grounded = mix(0.55, 1.0, smoothstep(0.0, 0.35, worldPosition.z + 0.35 * max(n.z, 0.0)));
  vec3 sky = mix(vec3(0.55, 0.50, 0.44), vec3(0.92, 1.0, 1.12), 0.5 + 0.5 * n.z);
  vec3 diffuse = sceneBuffer.ambientLight.rgb * sky * grounded;
  vec3 glint = vec3(0);
  vec3 toward = -sceneBuffer.directionalLights[0].direction.xyz;
  if (dot(toward, toward) > 0.0) {
    toward = normalize(toward);
    vec3 sun = sceneBuffer.directionalLights[0].emission.rgb;
    diffuse += sun * max(dot(n, toward), 0.0) * mix(0.8, 1.0, grounded);
    float gloss = max(0.0, 0.75 - materialBuffer.roughness);
    glint = sun * gloss * pow(max(dot(n, normalize(toward + eye)), 0.0), 12.0 + 60.0 * gloss);
    glint += sky * gloss * 0.35 * pow(1.0 - max(dot(n, eye), 0.0), 4.0);
  }
  return pow(clamp(pow(albedo, vec3(2.2)) * diffuse + glint, 0.0, 1.0), vec3(1.0 / 2.2));
}

void main() {
"""

FRAGMENT_END = "\n  outColor = vec4(shade(outColor.rgb * materialBuffer.baseColor.rgb), 1.0);\n}\n"


class ShaderError(RuntimeError):
    """The installed SAPIEN's unlit shader does not have the form that ours extends."""


def lit_vertex(source: str) -> str:
    """The unlit vertex shader with world normal and position as outputs."""
    return _replaced(source, "void main() {", VERTEX_OUTPUTS)


def lit_fragment(source: str) -> str:
    """The unlit fragment shader with our lighting applied to its colour."""
    opened = _replaced(source, "void main() {", FRAGMENT_INPUTS).rstrip()
    if not opened.endswith("}"):
        raise ShaderError("expected the unlit fragment shader to end with the brace of main()")
    return opened[:-1] + FRAGMENT_END


def _replaced(source: str, marker: str, text: str) -> str:
    if source.count(marker) != 1:
        raise ShaderError(
            f"expected {marker!r} once in the unlit shader, got {source.count(marker)}"
        )
    return source.replace(marker, text)


@lru_cache(maxsize=1)
def _folder() -> tempfile.TemporaryDirectory[str]:
    """Lives as long as the process: SAPIEN reads it again for every camera."""
    unlit = Path(sapien.__file__).parent / "vulkan_shader" / "trivial"
    folder = tempfile.TemporaryDirectory(prefix="incognita-shader-")
    for name, lit in (("gbuffer.vert", lit_vertex), ("gbuffer.frag", lit_fragment)):
        (Path(folder.name) / name).write_text(lit((unlit / name).read_text()))
    return folder


def lit_shader_dir() -> str:
    """Folder of the lit shader, made on the first call of the process."""
    return _folder().name
