#!/bin/sh
# Renders the pictures of docs/materials.md into assets/images/materials. Run it in this folder; needs
# ImageMagick.
set -e

picture() {
    scene=$1 name=$2
    shift 2
    taki render "$scene" "$@" -o "$name.png" --overwrite
    convert "$name.png" -quality 90 "../../assets/images/materials/$name.jpg"
    rm "$name.png"
}

picture patch.toml plain --set volumes.fur.clumps=0
picture patch.toml few --set volumes.fur.clumps=0 --set volumes.fur.hairs=800
picture patch.toml guard --set volumes.fur.clumps=0 --set volumes.fur.undercoat=0
picture patch.toml clumps --set volumes.fur.clumping=0.8
picture patch.toml lean --set volumes.fur.clumps=0 --set volumes.fur.lean=1.5
picture patch.toml curl --set volumes.fur.clumps=0 --set volumes.fur.amplitude=0.3

picture slope_patch.toml slope
picture slope_patch.toml smooth --set volumes.face.fracture=0
picture slope_patch.toml beds --set volumes.face.beds=1
picture slope_patch.toml scree --set volumes.face.scree=0.6 --set volumes.face.stone_size=0.1
picture slope_patch.toml moss --set volumes.face.moss=0.9 --set volumes.face.soil=0.15 \
    --set volumes.face.blades=3000
picture slope_patch.toml meadow --set volumes.face.soil=0.85 --set volumes.face.blades=28000

# Of the same mean density: 7.7 % of the cells of grains are full.
view="--size 320x320 --set camera.target=-2.4,0.6,0 --set camera.fov=24"
picture waterfall curves $view
picture waterfall grains $view --set volume.builder=grains --set grains.filled=0.077

skin() {
    name=$1
    shift
    picture ../../assets/scenes/skin.toml "$name" --set image.width=320 --set image.height=320 \
        --set camera.fov=9 --set camera.target=-0.02,0.13,0 --set image.samples=8 "$@"
}
skin skin
skin melanin --set volumes.skin.melanin=0.3
skin blood --set volumes.skin.blood=0.05
skin oily --set volumes.skin.roughness=0.12
skin furrow --set volumes.skin.furrow=0.08
skin translucent --set trace.sigma=1000

picture swatch.toml plain_weave
picture swatch.toml twill --set cloth.weave=twill
picture swatch.toml satin --set cloth.weave=satin
picture swatch.toml gauze --set cloth.yarn=0.5
picture swatch.toml twist --set cloth.twist=2 --set cloth.fibres=14
picture swatch.toml fuzz --set cloth.fuzz=8

hair() {
    name=$1
    shift
    picture ../../assets/scenes/hair.toml "$name" --set image.width=320 --set image.height=320 \
        --set camera.fov=11 --set camera.target=0,1.4,-0.08 --set image.samples=8 "$@"
}
hair hair
hair loose --set volumes.locks.locks=0
hair gathered --set volumes.locks.gathering=0.95
hair waves --set volumes.locks.wave=0.06
hair unruly --set volumes.locks.stray=0.6 --set volumes.locks.amplitude=0.02
hair layers --set volumes.locks.reach=0.7 --set volumes.locks.reach_spread=0.15
