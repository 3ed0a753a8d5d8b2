#!/bin/sh
# Renders the pictures of docs/materials.md into assets/images/materials. Run it in this folder; needs ImageMagick.
set -e
to=../../assets/images/materials

fur() {
    name=$1
    shift
    taki render patch.toml "$@" -o "$name.png" --overwrite
    convert "$name.png" -quality 90 "$to/$name.jpg"
    rm "$name.png"
}

cloth() {
    name=$1
    shift
    taki render swatch.toml "$@" -o "$name.png" --overwrite
    convert "$name.png" -quality 90 "$to/$name.jpg"
    rm "$name.png"
}

fur plain --set volumes.fur.clumps=0
fur few --set volumes.fur.clumps=0 --set volumes.fur.hairs=800
fur guard --set volumes.fur.clumps=0 --set volumes.fur.undercoat=0
fur clumps --set volumes.fur.clumping=0.8
fur lean --set volumes.fur.clumps=0 --set volumes.fur.lean=1.5
fur curl --set volumes.fur.clumps=0 --set volumes.fur.amplitude=0.3

cloth plain_weave
cloth twill --set cloth.weave=twill
cloth satin --set cloth.weave=satin
cloth gauze --set cloth.yarn=0.5
cloth twist --set cloth.twist=2 --set cloth.fibres=14
cloth fuzz --set cloth.fuzz=8
