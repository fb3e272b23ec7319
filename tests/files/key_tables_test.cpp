#include "engine/files/key_tables.h"

#include "engine/files/json_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>

namespace stylet::files {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr struct { Key min = key::vector("min", "m", {-5, 5}, "lower corner"); } kBox;

constexpr struct {
  Key name = key::text("name", "shown to the user");
  Key source = key::kSource;
  Key length = key::number("length_mm", "mm", {20, 400}, "hub to tip").known_as("length");
  Key beams = key::integer("beams", {1, 64}, "elements").otherwise(8);
  Key gel = key::boolean("gel", "between").otherwise(true);
  Key share = key::number("share", "", {0, 1}, "absent: the preset's").optional();
  Key frame = key::choice("frame", files::one_of<"patient", "room">, "of all").otherwise("patient");
  Key cell = key::number("cell_mm", "mm", {1, 100}, "edge").either();
  Key nodes = key::integer("target_nodes", {50, 50000}, "nodes").either();
  Key boxes = key::objects("boxes", table_of<kBox>, "fields | regions").count({1, 4}).optional();
  Key rows = key::entries("rows", table_of<kBox>, "by name").optional();
  Key kind = key::choice("kind", files::one_of<"none", "biopsy">, "what is done").otherwise("none");
} kThing;

constexpr struct { Key bore = key::number("bore_mm", "mm", {0.2, 5}, "of the core"); } kBiopsy;

const KeyTable& thing_table() {
  static const KeyTable table{
      .keys = keys_of(kThing), .by = kThing.kind.name, .variants = {{"biopsy", keys_of(kBiopsy)}}};
  return table;
}

const FileFormat kFormat{.name = "thing", .title = "A thing", .table = thing_table, .id = "stylet-thing"};

constexpr std::string_view kBegin = R"({"format": "stylet-thing", "version": 1, )";

std::string file_with(const std::string& members) {
  return std::string(kBegin) + members + "}";
}

TEST(KeyTables, ReadWithTypeRangeAndDefaultOfTheKey) {
  JsonFile file("a.json", file_with(R"("name": "x", "length": 500, "boxes": [{"min": [0, 9, 0]}], "gel": false)"));
  JsonObject root = file.root(kFormat);
  EXPECT_EQ(root.text(kThing.name), "x");
  root.number(kThing.length);
  EXPECT_EQ(root.integer(kThing.beams), 8);
  EXPECT_FALSE(root.boolean(kThing.gel));
  EXPECT_TRUE(std::isnan(root.number(kThing.share))) << "optional, without a default";
  EXPECT_EQ(root.choice(kThing.frame), "patient");
  for (JsonObject& box : root.objects(kThing.boxes)) box.vector3(kBox.min);
  EXPECT_THAT(file.problems(), ElementsAre("a.json:/length_mm: is 500, accepted is 20 to 400",
                                           "a.json:/boxes/0/min/1: is 9, accepted is -5 to 5"));
}

TEST(KeyTables, KeysOfTheTableAreKnownWhetherTheyWereReadOrNot) {
  JsonFile file("a.json", file_with(R"("source": "s", "gel": true, "bore_mm": 1, "bore": 1, "boxes": [{"mim": 1}])"));
  JsonObject root = file.root(kFormat);
  for (JsonObject& box : root.objects(kThing.boxes)) box.finish();
  root.finish();
  EXPECT_THAT(file.problems(), ElementsAre("a.json:/boxes/0/mim: is not a known key; did you mean \"min\"?",
                                           "a.json:/bore: is not a known key; did you mean \"bore_mm\"?"));
}

TEST(KeyTables, SchemaHasTypeRangeDefaultAndWhatMustBeThere) {
  const json schema = json::parse(json_schema(kFormat));
  EXPECT_EQ(schema["required"], json({"format", "version", "name", "length_mm"}));
  EXPECT_EQ(schema["properties"]["format"]["const"], "stylet-thing");
  EXPECT_EQ(schema["properties"]["length_mm"], json::parse(R"({"description": "hub to tip; mm", "type": "number",
                                                               "minimum": 20, "maximum": 400})"));
  EXPECT_EQ(schema["properties"]["beams"]["description"], "elements; default 8");
  EXPECT_EQ(schema["properties"]["frame"]["enum"], json({"patient", "room"}));
  EXPECT_EQ(schema["properties"]["boxes"]["maxItems"], 4);
  EXPECT_EQ(schema["properties"]["boxes"]["items"]["required"], json({"min"}));
  EXPECT_EQ(schema["properties"]["rows"]["additionalProperties"]["properties"]["min"]["minItems"], 3);
  EXPECT_EQ(schema["oneOf"], json::parse(R"([{"required": ["cell_mm"]}, {"required": ["target_nodes"]}])"));
  EXPECT_EQ(schema["properties"]["bore_mm"]["description"], "biopsy: of the core; mm") << "of a variant";
  EXPECT_EQ(schema["additionalProperties"], false);
}

TEST(KeyTables, MarkdownHasARowAKeyUnderItsPath) {
  const std::string table = markdown_table(kFormat);
  EXPECT_THAT(table, HasSubstr("| `length_mm` | number 20 to 400 mm | hub to tip; also length |\n"));
  EXPECT_THAT(table, HasSubstr("| `beams` | whole number 1 to 64; default 8 | elements |\n"));
  EXPECT_THAT(table, HasSubstr("| `cell_mm` | number 1 to 100 mm; alternative | edge |\n"));
  EXPECT_THAT(table, HasSubstr("| `boxes` | list of 1 to 4 objects; optional | fields \\| regions |\n"));
  EXPECT_THAT(table, HasSubstr("| `boxes[].min` | [x, y, z] -5 to 5 m | lower corner |\n"));
  EXPECT_THAT(table, HasSubstr("| `rows.NAME.min` |"));
}

TEST(KeyTables, PlainTableIndentsTheKeysOfObjects) {
  const std::string table = plain_table(kFormat);
  EXPECT_THAT(table, HasSubstr("stylet-thing 1: A thing\n"));
  EXPECT_THAT(table, HasSubstr("\n  beams "));
  EXPECT_THAT(table, HasSubstr("\n    min "));
}

TEST(KeyTables, GeneratedTextReplacesWhatIsBetweenItsMarks) {
  const std::string page = "a\n<!-- stylet schema thing -->\nold\n<!-- end -->\nb\n<!-- end -->\n";
  EXPECT_EQ(with_generated(page, "thing", "new\n"),
            "a\n<!-- stylet schema thing -->\nnew\n<!-- end -->\nb\n<!-- end -->\n");
  EXPECT_THROW(with_generated(page, "other", "new\n"), ContentError);
}

}  // namespace
}  // namespace stylet::files
