// Names of buffer metadata are made and taken apart alike.
#include "ir/buffer_metadata.h"

#include <gtest/gtest.h>

#include "ir/print.h"

namespace retrograde {
namespace {

using namespace ir;

TEST(BufferMetadata, NamesConsistOfBufferFieldAndDimension) {
  EXPECT_EQ(metadata_name("input", Metadata::Min, 0), "input.min.0");
  EXPECT_EQ(metadata_name("f.1", Metadata::Stride, 12), "f.1.stride.12");
  EXPECT_EQ(print(metadata("input", Metadata::Extent, 1)), "input.extent.1");
  const auto [min, extent] = metadata_range("input", 2);
  EXPECT_EQ(print(min) + " " + print(extent), "input.min.2 input.extent.2");
}

TEST(BufferMetadata, EveryDimensionHasThree) {
  EXPECT_EQ(metadata_names("b", 2),
            (std::vector<std::string>{"b.min.0", "b.extent.0", "b.stride.0", "b.min.1",
                                      "b.extent.1", "b.stride.1"}));
  EXPECT_TRUE(metadata_names("b", 0).empty());
}

TEST(BufferMetadata, NamesAreTakenApart) {
  // The buffers' own names have dots, and may look like metadata.
  for (const std::string buffer : {"b", "f.1", "f.$2", "b.min.0", ""}) {
    for (const std::string& name : metadata_names(buffer, 11)) {
      const auto parsed = parse_metadata_name(name);
      ASSERT_TRUE(parsed) << name;
      EXPECT_EQ(parsed->buffer, buffer);
      EXPECT_EQ(metadata_name(parsed->buffer, parsed->what, parsed->dimension), name);
    }
  }
}

TEST(BufferMetadata, OtherNamesAreNone) {
  for (const char* name :
       {"", ".", "..", "b", "b.0", "min.0", "b.min", "b.min.", "b.max.0", "b.minimum.0", "b.min.x",
        "b.min.-1", "b.min.0.actual", "b.min.1x", "b.min.99999999999999999999999"})
    EXPECT_FALSE(parse_metadata_name(name)) << name;
}

}  // namespace
}  // namespace retrograde
