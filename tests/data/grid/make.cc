// Makes the grids that Python's openvdb cannot: zip, rare transforms, a tree of other branches, grids that share
// one tree, and points. Debian 12:
//   apt-get install libopenvdb-dev g++ && g++ -std=c++17 -O1 make.cc -lopenvdb -ltbb -lImath-3_1 -o make && ./make FOLDER
#include <openvdb/openvdb.h>
#include <openvdb/io/File.h>
#include <openvdb/math/Maps.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/tree/Tree.h>

using namespace openvdb;

static int code(int x, int y, int z) { return (x * 7 + y * 13 + z * 29) % 64; }

template <class Grid> static void fill(Grid& grid) {
    auto accessor = grid.getAccessor();
    for (int x = 1; x < 10; ++x)
        for (int y = 2; y < 10; ++y)
            for (int z = 3; z < 10; ++z)
                if (code(x, y, z) % 3) accessor.setValueOn(Coord(x, y, z), code(x, y, z) / 64.0f);
}

static FloatGrid::Ptr density(const char* name) {
    auto grid = FloatGrid::create(0.0f);
    grid->setName(name);
    fill(*grid);
    return grid;
}

static void write(const std::string& file, const GridPtrVec& grids, uint32_t compression) {
    io::File out(file);
    out.setCompression(compression);
    out.write(grids);
    out.close();
}

int main(int, char** arguments) {
    initialize();
    const std::string folder = std::string(arguments[1]) + "/cc_";
    auto half = density("half");
    half->setSaveFloatAsHalf(true);
    write(folder + "zip.vdb", {density("density"), half}, io::COMPRESS_ZIP);
    write(folder + "zip_mask.vdb", {density("density"), half}, io::COMPRESS_ZIP | io::COMPRESS_ACTIVE_MASK);

    GridPtrVec grids;
    auto with = [&](const char* name, math::MapBase::Ptr map) {
        auto grid = FloatGrid::create(0.0f);
        grid->setName(name);
        grid->setTransform(math::Transform::Ptr(new math::Transform(map)));
        grids.push_back(grid);
    };
    with("scale", math::MapBase::Ptr(new math::ScaleMap(Vec3d(1, 2, 3))));
    with("uniform", math::MapBase::Ptr(new math::UniformScaleMap(2)));
    with("scale_translate", math::MapBase::Ptr(new math::ScaleTranslateMap(Vec3d(1, 2, 3), Vec3d(4, 5, 6))));
    with("uniform_translate", math::MapBase::Ptr(new math::UniformScaleTranslateMap(2, Vec3d(4, 5, 6))));
    with("translate", math::MapBase::Ptr(new math::TranslationMap(Vec3d(4, 5, 6))));
    with("turn", math::MapBase::Ptr(new math::UnitaryMap(Vec3d(0, 0, 1), M_PI / 2)));
    const math::Mat4d shear(1., 0., 0., 0., 0.5, 1., 0., 0., 0., 0., 1., 0., 4., 5., 6., 1.);
    with("affine", math::MapBase::Ptr(new math::AffineMap(shear)));
    with("frustum", math::MapBase::Ptr(new math::NonlinearFrustumMap(BBoxd(Vec3d(0), Vec3d(8)), 0.5, 2.0)));
    write(folder + "transforms.vdb", grids, io::COMPRESS_BLOSC | io::COMPRESS_ACTIVE_MASK);

    using Other = Grid<tree::Tree<tree::RootNode<tree::InternalNode<tree::InternalNode<tree::LeafNode<float, 4>, 2>, 3>>>>;
    Other::registerGrid();
    auto other = Other::create(0.0f);
    other->setName("other");
    fill(*other);
    other->tree().addTile(2, Coord(64, 0, 0), 2.0f, true);
    write(folder + "other_tree.vdb", {other}, io::COMPRESS_ACTIVE_MASK);

    auto first = density("first");
    auto second = FloatGrid::create(first->treePtr());
    second->setName("second");
    second->setTransform(math::Transform::createLinearTransform(0.5));
    write(folder + "shared.vdb", {first, second}, io::COMPRESS_ACTIVE_MASK);

    const std::vector<Vec3d> places{{0, 0, 0}, {1, 2, 3}};
    points::PointAttributeVector<Vec3d> wrapper(places);
    auto transform = math::Transform::createLinearTransform(0.5);
    auto index = tools::createPointIndexGrid<tools::PointIndexGrid>(wrapper, *transform);
    auto points = points::createPointDataGrid<points::NullCodec, points::PointDataGrid>(*index, wrapper, *transform);
    points->setName("points");
    write(folder + "points.vdb", {points, density("density")}, io::COMPRESS_BLOSC | io::COMPRESS_ACTIVE_MASK);
}
