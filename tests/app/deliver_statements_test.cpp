// Naming a record store: its version, what was refused, what waits for another one.
#include "engine/app/deliver_statements.h"

#include "engine/files/error.h"
#include "tests/lab/record_store_server.h"
#include "tests/lab/refusal.h"
#include "tests/lab/sample_attempts.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace stylet::app {
namespace {

namespace fs = std::filesystem;
namespace store = lab::store;
using lab::test::RecordStoreServer;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class Connect : public ::testing::Test {
protected:
  Connect() {
    lab_.set_consent(ada_.id, store::kRecordStore, true);
    fs::permissions(key_, fs::perms::owner_read | fs::perms::owner_write);
  }
  StoreAddress address(const std::string& endpoint) const {
    return {.endpoint = endpoint, .home_page = "https://lab.example/stylet/", .key_file = key_.string()};
  }
  void take() { lab_.end(lab_.begin(store::test::start_of(ada_)), store::test::end_of(80, true)); }
  int waiting() { return lab::delivery::outbox_state(lab_.database()).waiting; }

  support::TemporaryFolder folder_;
  fs::path key_ = folder_.write("key", std::string(RecordStoreServer::kKey) + "\n");
  store::Lab lab_{{.folder = folder_.path() / "lab", .build = "test"}};
  store::Person ada_ = lab_.enrolled("ada");
};

TEST_F(Connect, TheVersionIsTheStoresUnlessItIsGiven) {
  for (const char* version : {"1.0.3", "2.0.0"}) {
    RecordStoreServer server;
    server.speak(version);
    const Connected connected = connect_record_store(lab_, address(server.endpoint()));
    EXPECT_EQ(connected.version, version);
    EXPECT_THAT(connected.not_asked, IsEmpty());
    take();
    const auto delivery = deliver_statements(lab_);
    ASSERT_TRUE(delivery.has_value());
    EXPECT_EQ(delivery->sent.delivered, 3) << delivery->sent.stopped_by;
    EXPECT_THAT(server.statements(), SizeIs(3));
    // The other one, by hand: this store does not take it.
    StoreAddress wrong = address(server.endpoint());
    wrong.version = std::string(version) == "1.0.3" ? "2.0.0" : "1.0.3";
    EXPECT_EQ(connect_record_store(lab_, wrong).version, wrong.version);
    take();
    EXPECT_EQ(deliver_statements(lab_)->sent.delivered, 0);
    EXPECT_EQ(lab::delivery::outbox_state(lab_.database()).rejected, 3);
    const Connected again = connect_record_store(lab_, address(server.endpoint()));
    EXPECT_EQ(again.tried_again, 3) << "what was refused is tried again";
    EXPECT_EQ(deliver_statements(lab_)->sent.delivered, 3);
  }
}

TEST_F(Connect, AStoreThatDoesNotSayIsTakenForTheNewest) {
  const Connected away = connect_record_store(lab_, address("http://127.0.0.1:1/xapi"));
  EXPECT_EQ(away.version, "2.0.0");
  EXPECT_NE(away.not_asked, "");
  RecordStoreServer server;
  server.set(RecordStoreServer::Mood::babbling);
  EXPECT_THAT(connect_record_store(lab_, address(server.endpoint())).not_asked, HasSubstr("answers 200"));
}

TEST_F(Connect, WhatWaitsGoesToAnotherStoreOnlyWhereSomebodySaysSo) {
  connect_record_store(lab_, address("http://127.0.0.1:1/xapi"));
  take();
  EXPECT_EQ(waiting(), 3);
  RecordStoreServer server;
  for (const bool off : {false, true}) {
    if (off) connect_record_store(lab_, {});
    EXPECT_THAT(lab::refusal([&] { connect_record_store(lab_, address(server.endpoint())); }),
                HasSubstr("3 statements wait for http://127.0.0.1:1/xapi"));
    EXPECT_EQ(lab_.setting(store::kEndpoint), off ? "" : "http://127.0.0.1:1/xapi") << "nothing is changed";
  }
  connect_record_store(lab_, address("http://127.0.0.1:1/xapi"));  // the same as before: nothing to say
  EXPECT_EQ(waiting(), 3);
  StoreAddress told = address(server.endpoint());
  told.waiting = Waiting::send;
  connect_record_store(lab_, told);
  EXPECT_EQ(deliver_statements(lab_)->sent.delivered, 3);
  server.set(RecordStoreServer::Mood::gone);
  take();
  EXPECT_EQ(waiting(), 3);
  RecordStoreServer other;
  told = address(other.endpoint());
  told.waiting = Waiting::drop;
  connect_record_store(lab_, told);
  EXPECT_EQ(waiting(), 0);
  EXPECT_THAT(other.statements(), IsEmpty());
  take();
  EXPECT_EQ(deliver_statements(lab_)->sent.delivered, 3);
}

}  // namespace
}  // namespace stylet::app
