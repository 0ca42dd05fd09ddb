// MOZ_lightmap for three.js, whose GLTFLoader does not know it: `loader.register((parser) => new Lightmaps(parser))`.
//
// The texture of the extension becomes `lightMap` of the material. three.js multiplies lightMap * lightMapIntensity, an
// irradiance, by albedo / pi, so that the picture is the radiance that halflight renders.

import { SRGBColorSpace } from "three";

/** A plugin of GLTFLoader that reads lightmaps of materials. */
export class Lightmaps {
  constructor(parser) {
    this.parser = parser;
    this.name = "MOZ_lightmap";
  }

  /** Gives a material of three.js the map of a material of glTF. */
  async extendMaterialParams(index, params) {
    const own = this.parser.json.materials[index].extensions?.[this.name];
    if (own === undefined) return;
    params.lightMapIntensity = own.intensity ?? 1;
    const texture = { index: own.index, texCoord: own.texCoord ?? 1 };
    await this.parser.assignTexture(params, "lightMap", texture, SRGBColorSpace);
  }
}
