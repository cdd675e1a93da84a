// headless_logger [SESSION [SECONDS]]: an observer that writes a log of the session as CSV. Everything
// happens in this thread, within update().
#include <cstdio>
#include <cstdlib>
#include <tandem/client.hpp>

int main(int argc, char** argv) {
  tandem::ClientOptions options;
  if (argc > 1) options.session = argv[1];
  const double seconds = argc > 2 ? std::atof(argv[2]) : 10;
  options.role = tandem::ClientRole::kObserver;
  options.background = false;
  options.log = [](tandem::LogLevel, std::string_view line) {
    std::fprintf(stderr, "%.*s\n", static_cast<int>(line.size()), line.data());
  };
  auto client = tandem::Client::connect(options);
  if (!client) return std::fprintf(stderr, "%s\n", client.error().message.c_str()), 1;

  std::puts("second,phase,frame,alive,mbit_per_s,latency_ms,resyncs,hash_mismatches");
  for (int second = 1; second <= seconds; ++second) {
    client->run_for(1);
    while (const auto event = client->next_event()) {
      std::printf("# event %d, epoch %llu, frame %llu %s\n", event->kind,
                  static_cast<unsigned long long>(event->epoch),
                  static_cast<unsigned long long>(event->frame), event->text);
    }
    const auto status = client->status();
    if (!status) return std::fprintf(stderr, "%s\n", status.error().message.c_str()), 1;
    const auto frame = client->sample_frame();
    std::printf("%d,%d,%llu,%u,%.3f,%.2f,%llu,%llu\n", second, static_cast<int>(status->phase),
                static_cast<unsigned long long>(status->frame), frame ? frame->alive : 0, status->mbit_per_s,
                status->latency_ms_p50, static_cast<unsigned long long>(status->resyncs),
                static_cast<unsigned long long>(status->hash_mismatches));
  }
  const auto status = client->status();
  return status && status->frames_applied > 0 && status->hash_mismatches == 0 ? 0 : 1;
}
