// The link and clients made of the OpenIGTLink library, over loopback.
#include "engine/link/link.h"

#include "engine/link/link_error.h"
#include "engine/link/message.h"
#include "engine/tracking/tracked_transforms.h"
#include "tests/link/igtl_client.h"

#include <igtlTrackingDataMessage.h>
#include <igtl_header.h>
#include <igtl_util.h>

#include <gtest/gtest.h>

#include <chrono>
#include <cstring>
#include <limits>
#include <thread>

namespace stylet::link {
namespace {

using tests::ClientMessage;
using tests::IgtlClient;

constexpr int kWidth = 400;
constexpr int kHeight = 300;
const LinkSettings kAnyPort{.listen = Endpoint{.port = 0}, .transform_hz = 250};

state::FrameState small_world() {
  state::FrameState frame;
  frame.time_s = 1.5;
  frame.simulation_step = 75;
  frame.probe_position = {0.02F, 0.11F, 0.13F};
  frame.probe_orientation = Eigen::AngleAxisf(2.0F, Eigen::Vector3f(1, 0.3F, -0.2F).normalized());
  frame.needle_positions = {{0.05F, 0.1F, 0.3F}, {0.04F, 0.1F, 0.2F}, {0.03F, 0.11F, 0.1F}};
  frame.needle_orientations.assign(3, Eigen::Quaternionf(Eigen::AngleAxisf(3.0F, Eigen::Vector3f::UnitX())));
  return frame;
}

/// A session that stands still, with a link.
struct Room {
  explicit Room(const LinkSettings& settings = kAnyPort, const LinkInputs& inputs = {})
      : world(small_world()), link(world, inputs, settings) {
    world.publish(small_world());
    link.start(1.5);
  }
  state::StateBuffer world;
  Link link;
};

/// An image that says which one it is.
LinkImage numbered_image(std::uint8_t number, int width = kWidth, int height = kHeight) {
  return {.time_s = 1.5,
          .width = width,
          .height = height,
          .pixels = std::vector<std::uint8_t>(static_cast<std::size_t>(width) * height, number)};
}

bool comes_true(const std::function<bool()>& condition) {
  const auto deadline = Clock::now() + std::chrono::seconds(20);
  while (!condition()) {
    if (Clock::now() > deadline) return false;
    std::this_thread::yield();
  }
  return true;
}

/// Patient (+X left, +Y superior, +Z anterior, m) to RAS mm, by hand.
Eigen::Vector3d ras_mm(const Eigen::Vector3f& p) {
  return {-1000.0 * double(p.x()), 1000.0 * double(p.z()), 1000.0 * double(p.y())};
}

TEST(Link, ImageAndTransformsSayTheSamePlaceToARealClient) {
  // A needle whose tip lies in the image plane: what the pixel says must be what the transform says.
  const ultrasound::SectorGeometry sector{
      .width = kWidth, .height = kHeight, .metres_per_pixel = 0.25e-3, .origin = {-0.05, -0.004}};
  constexpr int kColumn = 310;
  constexpr int kRow = 172;
  state::FrameState frame = small_world();
  const Eigen::Vector2d xz = sector.position({kColumn, kRow});
  frame.needle_positions.back() =
      frame.probe_position + frame.probe_orientation * Eigen::Vector3f(float(xz.x()), 0, float(xz.y()));
  state::StateBuffer world(frame);
  Link link(world, {}, kAnyPort);
  world.publish(frame);
  link.start(frame.time_s);
  const std::chrono::duration<double> begin = std::chrono::system_clock::now().time_since_epoch();

  LinkImage shown = numbered_image(7);
  shown.pixels[static_cast<std::size_t>(kRow) * kWidth + kColumn] = 255;
  shown.reference_from_image =
      tracking::ras_pose(frame.probe_position, frame.probe_orientation).lazyProduct(tracking::image_to_probe(sector));
  IgtlClient client;
  ASSERT_TRUE(client.connect(link.port()));
  link.show(shown);

  const ClientMessage status = client.receive("Stylet");
  EXPECT_EQ(status.type, "STATUS");
  EXPECT_EQ(status.code, 1);
  const ClientMessage image = client.receive("Image_Reference");
  ASSERT_EQ(image.type, "IMAGE");
  EXPECT_EQ(image.size, Eigen::Vector3i(kWidth, kHeight, 1));
  EXPECT_NEAR(image.spacing.x(), 0.25, 1e-6);
  EXPECT_NEAR(image.spacing.y(), 0.25, 1e-6);
  ASSERT_EQ(image.pixels.size(), shown.pixels.size());
  EXPECT_EQ(image.pixels, shown.pixels);
  const ClientMessage probe = client.receive("ProbeToReference");
  const ClientMessage hub = client.receive("NeedleToReference");
  const ClientMessage tip = client.receive("NeedleTipToReference");
  ASSERT_EQ(tip.type, "TRANSFORM");

  // RAS written out by hand from the patient frame; single precision over 0.3 m is 0.03 micrometres.
  EXPECT_LT((tip.matrix.topRightCorner<3, 1>() - ras_mm(frame.needle_positions.back())).norm(), 1e-4);
  EXPECT_LT((hub.matrix.topRightCorner<3, 1>() - ras_mm(frame.needle_positions.front())).norm(), 1e-4);
  EXPECT_LT((probe.matrix.topRightCorner<3, 1>() - ras_mm(frame.probe_position)).norm(), 1e-4);
  const Eigen::Vector3f into_body = frame.probe_orientation * Eigen::Vector3f::UnitZ();
  EXPECT_LT((probe.matrix.block<3, 1>(0, 2) - 1e-3 * ras_mm(into_body)).norm(), 1e-5);
  const Eigen::Vector4d pixel = image.ras_from_pixel() * Eigen::Vector4d(kColumn, kRow, 0, 1);
  EXPECT_LT((pixel.head<3>() - tip.matrix.topRightCorner<3, 1>()).norm(), 1e-3);
  const Eigen::Matrix3d axes = image.ras_from_pixel().topLeftCorner<3, 3>();
  EXPECT_GT(axes.determinant(), 0);

  // Both are of the same moment: UTC at session time 1.5 s.
  EXPECT_EQ(image.utc_s, tip.utc_s);
  EXPECT_NEAR(image.utc_s, begin.count(), 5);
}

TEST(Link, ListensOnLoopbackAloneByDefault) {
  Room alone;
  IgtlClient client;
  EXPECT_TRUE(client.connect(alone.link.port()));
  EXPECT_FALSE(client.connect(alone.link.port(), "127.0.0.2"));  // another address of this machine
  Room open({.listen = Endpoint{.host = "0.0.0.0", .port = 0}});
  EXPECT_TRUE(client.connect(open.link.port(), "127.0.0.2"));
  EXPECT_EQ(client.receive("Stylet").type, "STATUS");
}

TEST(Link, SaysWhichAddressItCannotHave) {
  Room first;
  const Endpoint taken{.port = first.link.port()};
  try {
    Link second(first.world, {}, {.listen = taken});
    ADD_FAILURE() << "two servers on a port";
  } catch (const LinkError& error) {
    EXPECT_NE(std::string(error.what()).find(to_string(taken)), std::string::npos) << error.what();
  }
  EXPECT_THROW(Link(first.world, {}, {.listen = Endpoint{.host = "no.such.host.invalid"}}), LinkError);
  for (const char* text : {"", "host", "host:", ":18944", "host:0", "host:65536", "host:18944x"}) {
    EXPECT_THROW(parse_endpoint(text), LinkError) << text;
  }
  EXPECT_EQ(parse_endpoint("[::1]:18944").host, "::1");
  EXPECT_EQ(to_string(parse_endpoint("[::1]:18944")), "[::1]:18944");
}

TEST(Link, AClientComesBackAndThreeAreServedAtOnce) {
  Room room;
  for (std::uint8_t round = 1; round <= 2; ++round) {
    std::array<IgtlClient, 3> clients;
    for (IgtlClient& client : clients) ASSERT_TRUE(client.connect(room.link.port()));
    room.link.show(numbered_image(round));
    for (IgtlClient& client : clients) {
      ClientMessage image = client.receive("Image_Reference");
      while (!image.pixels.empty() && image.pixels[0] != round) image = client.receive("Image_Reference");
      EXPECT_FALSE(image.pixels.empty());
      EXPECT_EQ(client.receive("NeedleTipToReference").type, "TRANSFORM");
    }
    for (IgtlClient& client : clients) client.close();
    EXPECT_TRUE(comes_true([&] { return room.link.clients() == 0; }));
  }
  const LinkReport& report = room.link.stop();
  EXPECT_EQ(report.clients, 6U);
  EXPECT_TRUE(report.problems.empty()) << report.problems.front();
}

/// Does what clients ask for until it goes: "yes" is done, all else is not.
std::jthread operate(Link& link) {
  return std::jthread([&link](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      while (const auto request = link.commands().next()) {
        link.commands().answer({request->number, request->text == "yes", "because " + request->text});
      }
      std::this_thread::yield();
    }
  });
}

TEST(Link, EightClientsAreServedAndTheNinthIsRefusedWhileNoneIsIdle) {
  LinkSettings settings = kAnyPort;
  settings.idle_s = 600;  // however slow this machine is
  Room room(settings);
  std::array<IgtlClient, Link::kMostClients> clients;
  for (IgtlClient& client : clients) {
    ASSERT_TRUE(client.connect(room.link.port()));
    EXPECT_EQ(client.receive("Stylet").type, "STATUS");
  }
  IgtlClient ninth;
  ASSERT_TRUE(ninth.connect(room.link.port()));
  EXPECT_TRUE(ninth.is_closed());
  EXPECT_EQ(clients[0].receive("ProbeToReference").type, "TRANSFORM");
  const LinkReport& report = room.link.stop();
  EXPECT_EQ(report.clients, 8U);
  EXPECT_EQ(report.refused, 1U);
}

TEST(Link, TheClientSilentLongestMakesRoomForTheNinth) {
  LinkSettings settings = kAnyPort;
  settings.idle_s = 0;
  Room room(settings);
  const std::jthread operator_thread = operate(room.link);
  std::array<IgtlClient, Link::kMostClients> clients;
  for (IgtlClient& client : clients) {
    ASSERT_TRUE(client.connect(room.link.port()));
    EXPECT_EQ(client.receive("Stylet").type, "STATUS");
  }
  auto word = igtl::StringMessage::New();
  word->SetDeviceName("CMD_1");
  word->SetString("yes");
  ASSERT_TRUE(clients[0].send(*word));
  ASSERT_EQ(clients[0].receive("ACK_1").type, "STRING") << "the first is heard, the second is silent longest";
  IgtlClient ninth;
  ASSERT_TRUE(ninth.connect(room.link.port()));
  EXPECT_EQ(ninth.receive("Stylet").type, "STATUS");
  EXPECT_TRUE(clients[1].is_closed());
  for (const int k : {0, 2, 7}) EXPECT_EQ(clients[k].receive("ProbeToReference").type, "TRANSFORM") << k;
  const LinkReport& report = room.link.stop();
  EXPECT_EQ(report.clients, 9U);
  EXPECT_EQ(report.refused, 0U);
  ASSERT_EQ(report.problems.size(), 1U);
  EXPECT_NE(report.problems[0].find("said nothing for"), std::string::npos) << report.problems[0];
}

TEST(Link, ASlowClientGetsTheNewestImagesAndDelaysNoOther) {
  LinkSettings settings = kAnyPort;
  settings.patience_s = 600;  // slow, not dead, however slow this machine is
  Room room(settings);
  IgtlClient slow;
  IgtlClient fast;
  ASSERT_TRUE(slow.connect(room.link.port()));
  ASSERT_TRUE(fast.connect(room.link.port()));
  // More than the kernel keeps for one that reads nothing; the other one has every image before the next is shown.
  constexpr int kImages = 30;
  for (int n = 1; n <= kImages; ++n) {
    room.link.show(numbered_image(static_cast<std::uint8_t>(n), 640, 480));
    const ClientMessage image = fast.receive("Image_Reference");
    ASSERT_EQ(image.type, "IMAGE");
    ASSERT_EQ(image.pixels[0], n);
  }
  int got = 0;
  int last = 0;
  while (last != kImages) {
    const ClientMessage image = slow.receive("Image_Reference");
    ASSERT_EQ(image.type, "IMAGE");
    EXPECT_GT(image.pixels[0], last);
    last = image.pixels[0];
    ++got;
  }
  EXPECT_LT(got, kImages);
  const LinkReport& report = room.link.stop();
  const auto& images = report.counts[static_cast<std::size_t>(Topic::image)];
  EXPECT_EQ(images.sent, static_cast<std::uint64_t>(kImages + got));
  EXPECT_EQ(images.sent + images.dropped, 2U * kImages);
  EXPECT_TRUE(report.problems.empty());
}

TEST(Link, ADeadClientIsPutOff) {
  LinkSettings settings = kAnyPort;
  settings.patience_s = 0.2;
  Room room(settings);
  IgtlClient dead;
  ASSERT_TRUE(dead.connect(room.link.port()));
  ASSERT_TRUE(comes_true([&] { return room.link.clients() == 1; }));
  const LinkImage image = numbered_image(1, 640, 480);
  EXPECT_TRUE(comes_true([&] {
    room.link.show(image);
    return room.link.clients() == 0;
  }));
  IgtlClient half;
  ASSERT_TRUE(half.connect(room.link.port()));
  Bytes message;
  append_transform(message, kNeedleName, 1, Eigen::Matrix4d::Identity());
  message.resize(70);
  ASSERT_TRUE(half.send(message));
  EXPECT_TRUE(half.is_closed());
  const LinkReport& report = room.link.stop();
  ASSERT_EQ(report.problems.size(), 2U);
  EXPECT_NE(report.problems[0].find("took nothing for 0.2 s"), std::string::npos) << report.problems[0];
  EXPECT_NE(report.problems[1].find("half a message"), std::string::npos) << report.problems[1];
}

Eigen::Matrix4d needle_at(double x_mm) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix(0, 3) = x_mm;
  matrix(1, 3) = 200;
  matrix(2, 3) = 100;
  return matrix;
}

/// Whether the stylus gets to a place of the tracker while its pose is sent again and again. The stylus is read on a
/// clock of the test's own, which stands still until a pose is there.
bool arrives(LinkStylus& stylus, double& time_s, double x_mm, const std::function<void()>& send) {
  const Eigen::Vector3d patient(-1e-3 * x_mm, 0.1, 0.2);
  return comes_true([&] {
    time_s += LinkStylus::kStale;
    send();
    haptic::StylusSample sample;
    const bool heard = comes_true([&] {
      sample = stylus.read(time_s);
      return sample.valid && sample.age_s == 0;
    });
    for (int step = 0; step < 90; ++step) sample = stylus.read(time_s += 0.001);
    return !heard || (sample.position - patient).norm() < 1e-4;
  });
}

TEST(Link, TransformsOfAClientMoveTheNeedle) {
  LinkStylus stylus({.position = {0, 0.1, 0.21}});
  Room room(kAnyPort, {.needle = &stylus});
  double time_s = 0;
  EXPECT_FALSE(stylus.read(time_s).valid);
  IgtlClient client;
  ASSERT_TRUE(client.connect(room.link.port()));
  const auto follows = [&](const char* name, double x_mm) {
    return arrives(stylus, time_s, x_mm, [&] { client.send_transform(name, needle_at(x_mm)); });
  };
  EXPECT_TRUE(follows("NeedleToReference", 5));
  EXPECT_TRUE(follows("StylusToReference", -5));

  auto tracking = igtl::TrackingDataMessage::New();
  tracking->SetDeviceName("Tracker");
  auto tool = igtl::TrackingDataElement::New();
  tool->SetName("NeedleToReference");
  igtl::Matrix4x4 matrix;
  igtl::IdentityMatrix(matrix);
  matrix[0][3] = 11;
  matrix[1][3] = 200;
  matrix[2][3] = 100;
  tool->SetMatrix(matrix);
  tracking->AddTrackingDataElement(tool);
  EXPECT_TRUE(arrives(stylus, time_s, 11, [&] { client.send(*tracking); }));

  // Neither a stranger nor what is no pose moves it.
  Eigen::Matrix4d mirror = needle_at(50);
  mirror(2, 2) = -1;
  client.send_transform("CToReference", needle_at(50));
  client.send_transform("NeedleToReference", mirror);
  client.send_transform("NeedleToReference", needle_at(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_TRUE(follows("NeedleToReference", 12));
  const LinkReport& report = room.link.stop();
  EXPECT_EQ(report.passed_over, 1U);
  EXPECT_EQ(report.odd, 2U);
  EXPECT_GE(report.taken, 4U);
  EXPECT_TRUE(report.problems.empty());
}

struct BadBytes {
  const char* what;  ///< part of the line in the report
  Bytes bytes;
  bool leaves = false;
};

/// With the right check sum, unless the caller breaks it.
Bytes message_of(const char* type, const Bytes& body, std::uint16_t version = 1) {
  igtl_header header{};
  header.version = version;
  std::copy_n(type, std::min<std::size_t>(std::strlen(type), sizeof header.name), header.name);
  header.body_size = body.size();
  Bytes content = body;
  header.crc = crc64(content.data(), content.size(), 0);
  igtl_header_convert_byte_order(&header);
  Bytes bytes(sizeof header);
  std::memcpy(bytes.data(), &header, sizeof header);
  bytes.insert(bytes.end(), body.begin(), body.end());
  return bytes;
}

Bytes with_size(Bytes message, std::uint64_t size) {
  for (std::size_t k = 0; k < 8; ++k) message[42 + k] = static_cast<std::uint8_t>(size >> (56 - 8 * k));
  return message;
}

std::vector<BadBytes> bad_messages() {
  Bytes good;
  append_transform(good, kNeedleName, 1, Eigen::Matrix4d::Identity());
  Bytes wrong_sum = good;
  wrong_sum.back() ^= 1;
  const std::string http = "GET / HTTP/1.1\r\nHost: localhost:18944\r\nUser-Agent: a browser that is lost\r\n\r\n";
  Bytes half = good;
  half.resize(80);
  return {{"wrong check sum", wrong_sum},
          {"18446744073709551615 bytes", with_size(good, ~std::uint64_t(0))},
          {"9223372036854775808 bytes", with_size(good, std::uint64_t(1) << 63)},
          {"IMAGE message of 1099511627776 bytes", with_size(message_of("IMAGE", {}), std::uint64_t(1) << 40)},
          {"TRANSFORM message of 49 bytes", message_of("TRANSFORM", Bytes(49))},
          {"TRANSFORM message of 0 bytes", message_of("TRANSFORM", {})},
          {"TDATA message of 71 bytes", message_of("TDATA", Bytes(71))},
          {"COMMAND message that is shorter than its text", message_of("COMMAND", Bytes(137))},
          {"COMMAND message of 65537 bytes", with_size(message_of("COMMAND", {}), 65537)},
          {"extended header", message_of("TRANSFORM", Bytes(60, 0xFF), 2)},
          {"version 17", message_of("TRANSFORM", Bytes(48), 17)},
          {"without a message type", message_of("transform", Bytes(48))},
          {"version 18245", {http.begin(), http.end()}},
          {"in the middle of a message", half, true}};
}

TEST(Link, WhatIsNoMessageClosesItsClientAndNothingElse) {
  LinkStylus stylus({});
  Room room(kAnyPort, {.needle = &stylus});
  IgtlClient good;
  ASSERT_TRUE(good.connect(room.link.port()));
  const std::vector<BadBytes> bad = bad_messages();
  for (const BadBytes& message : bad) {
    IgtlClient client;
    ASSERT_TRUE(client.connect(room.link.port()));
    ASSERT_EQ(client.receive("Stylet").type, "STATUS");
    ASSERT_TRUE(client.send(message.bytes)) << message.what;
    if (message.leaves) client.close();
    if (!message.leaves) {
      EXPECT_TRUE(client.is_closed()) << message.what;
    }
    EXPECT_TRUE(comes_true([&] { return room.link.clients() == 1; })) << message.what;
    EXPECT_EQ(good.receive("NeedleToReference").type, "TRANSFORM");
  }
  const LinkReport& report = room.link.stop();
  ASSERT_EQ(report.problems.size(), bad.size());
  for (std::size_t k = 0; k < bad.size(); ++k) {
    EXPECT_NE(report.problems[k].find(bad[k].what), std::string::npos) << report.problems[k];
    EXPECT_EQ(report.problems[k].find('\n'), std::string::npos);
  }
  EXPECT_EQ(report.taken, 0U);
  EXPECT_EQ(summary(report).size(), 2 + bad.size());
}

TEST(Link, CommandsAreDoneAndAnsweredToTheClientThatAsked) {
  Room room;
  const std::jthread operator_thread = operate(room.link);
  IgtlClient client, other;
  ASSERT_TRUE(client.connect(room.link.port()));
  ASSERT_TRUE(other.connect(room.link.port()));
  auto message = igtl::StringMessage::New();
  message->SetDeviceName("CMD_7");
  message->SetString("yes");
  ASSERT_TRUE(client.send(*message));
  message->SetDeviceName("CMD_8");
  message->SetString("no");
  ASSERT_TRUE(other.send(*message));
  const ClientMessage yes = client.receive("ACK_7");
  EXPECT_EQ(yes.type, "STRING");
  EXPECT_EQ(yes.text, R"(<CommandReply Status="SUCCESS" Message="because yes" />)");
  EXPECT_EQ(other.receive("ACK_8").text, R"(<CommandReply Status="FAIL" Message="because no" />)");

  // A COMMAND: number 258, a name of 128 bytes, encoding, length, text.
  Bytes body{0, 0, 1, 2, 'S', 'e', 't'};
  body.resize(4 + 128);
  for (const char byte : std::string("\0\3\0\0\0\3yes", 9)) body.push_back(static_cast<std::uint8_t>(byte));
  ASSERT_TRUE(client.send(message_of("COMMAND", body)));
  ClientMessage reply = client.receive("Stylet");
  while (reply.type == "STATUS") reply = client.receive("Stylet");
  ASSERT_EQ(reply.type, "RTS_COMMAND");
  // Behind the 12 bytes of the extended header: the same number and name, then the text, then Status as meta data.
  ASSERT_GT(reply.body.size(), 12U + 138U);
  EXPECT_EQ(reply.body.substr(12, 7), std::string("\0\0\1\2Set", 7));
  EXPECT_EQ(reply.body.substr(12 + 138),
            std::string("<Command><Result>true</Result><Message>because yes</Message></Command>") +
                std::string("\0\1\0\6\0\3\0\0\0\7StatusSUCCESS", 23));
  const LinkReport& report = room.link.stop();
  EXPECT_EQ(report.commands, 2U);
  EXPECT_EQ(report.not_done, 1U);
  EXPECT_TRUE(report.problems.empty());
}

TEST(CommandDesk, RefusesWhereTooManyWaitAndWhereThereIsNoScanner) {
  CommandDesk desk;
  for (std::uint64_t n = 0; n < CommandDesk::kMost; ++n) desk.hand_in({n, "late"});
  desk.hand_in({1000, "one more"});
  std::vector<CommandDesk::Answer> answers = desk.take_answers();
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].number, 1000U);
  EXPECT_FALSE(answers[0].done);
  EXPECT_EQ(desk.next()->number, 0U);        // taken: it will be answered by who took it
  EXPECT_TRUE(desk.take_answers().empty());  // whoever attends may be slow
  desk.set_attended(false);
  answers = desk.take_answers();
  EXPECT_EQ(answers.size(), CommandDesk::kMost - 1);
  EXPECT_EQ(answers.front().words, "nobody is at the scanner");
  EXPECT_FALSE(desk.next().has_value());
}

TEST(Link, WhatAClientThatHasGoneAskedForIsNotDone) {
  Room room;
  IgtlClient client;
  ASSERT_TRUE(client.connect(room.link.port()));
  // All at once, as a busy machine reads them too; the answer that there are too many says that all the others wait.
  std::vector<std::uint8_t> flood;
  for (std::size_t n = 0; n <= CommandDesk::kMost; ++n) append_string(flood, "CMD_" + std::to_string(n), 1, "yes");
  ASSERT_TRUE(client.send(flood));
  ASSERT_EQ(client.receive("ACK_" + std::to_string(CommandDesk::kMost)).type, "STRING");
  const auto under_way = room.link.commands().next();
  ASSERT_TRUE(under_way.has_value());
  client.close();
  ASSERT_TRUE(comes_true([&] { return room.link.clients() == 0; }));
  EXPECT_FALSE(room.link.commands().next().has_value());
  room.link.commands().answer({under_way->number, true, "too late"});
  EXPECT_LE(room.link.stop().commands, 1U);
}

TEST(Link, ALostSourceIsReconnected) {
  LinkStylus stylus({.position = {0, 0.1, 0.21}});
  Socket server = listen_on({.port = 0});
  const Endpoint endpoint{.port = port_of(server)};
  Room room({.source = endpoint}, {.needle = &stylus});
  EXPECT_EQ(room.link.port(), 0);
  double time_s = 0;
  for (const double x_mm : {5.0, -5.0}) {
    std::optional<Accepted> peer;
    ASSERT_TRUE(comes_true([&] { return (peer = accept_from(server)).has_value(); }));
    Bytes message;
    append_transform(message, kNeedleName, 1, needle_at(x_mm));
    ASSERT_TRUE(arrives(stylus, time_s, x_mm, [&] { peer->socket.send(message); }));
    // Stylet only listens to a source: nothing is sent to it.
    std::array<std::uint8_t, 16> room_for_bytes{};
    EXPECT_EQ(peer->socket.receive(room_for_bytes).bytes, 0U);
    server = Socket();
    peer.reset();
    server = listen_on(endpoint);
  }
  EXPECT_GE(room.link.stop().source_connections, 2U);
}

TEST(Link, TheLoopsReadWholePosesInAStormOfThem) {
  // Each pose is on a line, so one that is torn is off it.
  LinkStylus stylus({});
  std::jthread storm([&](const std::stop_token& stop) {
    for (int n = 0; !stop.stop_requested(); ++n) {
      const double x = 1e-3 * (n % 100);
      stylus.follow({.position = {x, 2 * x, 3 * x}});
    }
  });
  for (int step = 0; step < 20'000; ++step) {
    const Eigen::Vector3d p = stylus.read(1e-3 * step).position;
    ASSERT_NEAR(p.y(), 2 * p.x(), 1e-12);
    ASSERT_NEAR(p.z(), 3 * p.x(), 1e-12);
  }
}

}  // namespace
}  // namespace stylet::link
