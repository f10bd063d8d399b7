#include "place_recognition/tag_sightings.h"

#include <gtest/gtest.h>

#include "place_recognition/place_recognition.h"
#include "place_recognition/test_world.h"

namespace pangea {
namespace {

using test::kMapA;
using test::kMapB;

std::vector<TagObservation> Tags(const std::vector<int>& ids) {
  std::vector<TagObservation> tags;
  for (const int id : ids) {
    tags.push_back({{TagFamily::k36h11, id}, {}});
  }
  return tags;
}

using Ids = std::vector<KeyframeId>;

TEST(TagSightings, OfAnotherMapTheNewestKeyframeAtOnce) {
  TagSightings sightings(20);
  sightings.Add({kMapA, 3}, Tags({5}));
  sightings.Add({kMapA, 4}, Tags({5, 6}));
  sightings.Add({kMapA, 9}, Tags({6}));
  EXPECT_EQ(sightings.Places({kMapB, 0}, Tags({5})), (Ids{{kMapA, 4}}));
  EXPECT_EQ(sightings.Places({kMapB, 0}, Tags({5, 6})), (Ids{{kMapA, 9}}));
  EXPECT_TRUE(sightings.Places({kMapB, 0}, Tags({7})).empty());
  EXPECT_TRUE(sightings.Places({kMapB, 0}, {}).empty());
}

TEST(TagSightings, OfTheOwnMapOneThatIsFarEnough) {
  TagSightings sightings(20);
  for (int seq = 0; seq < 60; ++seq) {
    sightings.Add({kMapA, seq}, Tags({5}));
  }
  EXPECT_TRUE(sightings.Places({kMapA, 19}, Tags({5})).empty());
  const Ids places = sightings.Places({kMapA, 60}, Tags({5}));
  ASSERT_EQ(places.size(), 1u);
  EXPECT_LE(places[0].seq, 40);
  EXPECT_GE(places[0].seq, 15);
}

TEST(TagSightings, OfManyMapsTheNewestFew) {
  TagSightings sightings(20);
  for (int map = 1; map <= 9; ++map) {
    sightings.Add({{map, 1000 + map}, 0}, Tags({5}));
  }
  const Ids places = sightings.Places({kMapB, 0}, Tags({5}));
  ASSERT_EQ(places.size(), 4u);
  EXPECT_EQ(places[0].map.agent_id, 9);
  EXPECT_EQ(places[3].map.agent_id, 6);
}

TEST(TagSightings, AreTheSameAfterARestart) {
  TagSightings sightings(20);
  for (int seq = 0; seq < 100; ++seq) {
    sightings.Add({kMapA, seq}, Tags({seq % 7, 8}));
  }
  ByteRecordWriter writer;
  sightings.Save(&writer);
  const std::vector<uint8_t> bytes = writer.Take();
  TagSightings restored(20);
  ByteRecordReader reader(bytes);
  restored.Restore(&reader);
  EXPECT_TRUE(reader.ok() && reader.at_end());
  EXPECT_EQ(restored.Places({kMapA, 100}, Tags({3})), sightings.Places({kMapA, 100}, Tags({3})));
  EXPECT_EQ(restored.Places({kMapB, 0}, Tags({8})), (Ids{{kMapA, 99}}));
}

// Images that have nothing in common.
TEST(PlaceRecognition, ATagMakesACandidateAtFirstSight) {
  test::TestWorld hall(1), other_hall(2);
  PlaceRecognition recognition({});
  Keyframe first = hall.See({kMapA, 0}, {0, 0, 1.5}, 0);
  first.tags = Tags({5});
  EXPECT_TRUE(recognition.Add(first).candidates.empty());
  Keyframe second = other_hall.See({kMapB, 0}, {0, 0, 1.5}, 0);
  second.tags = Tags({4, 5});
  const PlaceMatch match = recognition.Add(second);
  ASSERT_EQ(match.candidates.size(), 1u);
  EXPECT_EQ(match.candidates[0].match, first.id);
  EXPECT_EQ(match.candidates[0].kind, PlaceKind::kTag);
  EXPECT_TRUE(match.candidates[0].corner_matches.empty());
  EXPECT_EQ(recognition.counters().candidates_tag, 1);
}

TEST(PlaceRecognition, APairOfKeyframesIsACandidateOnce) {
  test::TestWorld hall(1);
  PlaceRecognition recognition({});
  Keyframe first = hall.See({kMapA, 0}, {0, 0, 1.5}, 0);
  first.tags = Tags({5});
  recognition.Add(first);
  Keyframe second = hall.See({kMapB, 0}, {0.1, 0, 1.5}, 0);
  second.tags = Tags({5});
  const PlaceMatch match = recognition.Add(second);
  ASSERT_EQ(match.candidates.size(), 1u);
  EXPECT_EQ(match.candidates[0].kind, PlaceKind::kTag);
  EXPECT_FALSE(match.candidates[0].corner_matches.empty());
}

}  // namespace
}  // namespace pangea
