#!/bin/sh
# Renders the pictures of docs/materials.md into assets/images/materials. Run it in this folder; needs
# ImageMagick.
set -e

picture() {
    scene=$1 name=$2
    shift 2
    taki render "$scene.toml" "$@" -o "$name.png" --overwrite
    convert "$name.png" -quality 90 "../../assets/images/materials/$name.jpg"
    rm "$name.png"
}

picture patch plain --set volumes.fur.clumps=0
picture patch few --set volumes.fur.clumps=0 --set volumes.fur.hairs=800
picture patch guard --set volumes.fur.clumps=0 --set volumes.fur.undercoat=0
picture patch clumps --set volumes.fur.clumping=0.8
picture patch lean --set volumes.fur.clumps=0 --set volumes.fur.lean=1.5
picture patch curl --set volumes.fur.clumps=0 --set volumes.fur.amplitude=0.3

picture swatch plain_weave
picture swatch twill --set cloth.weave=twill
picture swatch satin --set cloth.weave=satin
picture swatch gauze --set cloth.yarn=0.5
picture swatch twist --set cloth.twist=2 --set cloth.fibres=14
picture swatch fuzz --set cloth.fuzz=8

hair() {
    name=$1
    shift
    picture ../../assets/scenes/hair "$name" --set image.width=320 --set image.height=320 \
        --set camera.fov=11 --set camera.target=0,1.4,-0.08 --set image.samples=8 "$@"
}
hair hair
hair loose --set volumes.locks.locks=0
hair gathered --set volumes.locks.gathering=0.95
hair waves --set volumes.locks.wave=0.06 --set volumes.locks.waves=5
hair unruly --set volumes.locks.stray=0.6 --set volumes.locks.amplitude=0.02
hair layers --set volumes.locks.reach=0.7 --set volumes.locks.reach_spread=0.15
