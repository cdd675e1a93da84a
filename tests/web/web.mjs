// nginx as deploy/http configures it, for one test or measurement, over a folder of its own.

import { spawn } from 'node:child_process';
import { cpSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

import { check, until } from './stage.mjs';

async function freePort() {
  const server = createServer();
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  const { port } = server.address();
  await new Promise((resolve) => server.close(resolve));
  return port;
}

/** An origin and a cache of deploy/http, on ports of their own, over a folder with the viewer. */
export class Web {
  #children = [];

  /** `configuration`: deploy/http; `nginx`: its path; `sites`: built viewers, by the names of their folders here. */
  constructor(options) {
    this.options = options;
    this.root = mkdtempSync(join(tmpdir(), 'audience-'));
    for (const [name, site] of Object.entries(options.sites)) cpSync(site, this.folder(name), { recursive: true });
  }

  folder(name) {
    return join(this.root, 'site', name);
  }

  /** Starts nginx with a configuration of deploy/http; `changes` are texts and what they become. */
  async start(name, port, changes) {
    const prefix = join(this.root, name);
    mkdirSync(prefix, { recursive: true });
    let text = readFileSync(join(this.options.configuration, `${name}.conf`), 'utf8').replace(/listen \[::\].*/g, '');
    text = text.replace('access_log off', `access_log ${prefix}/access.log asked`);
    for (const [from, to] of [[/listen \d+/, `listen 127.0.0.1:${port}`], ...changes]) text = text.replace(from, to);
    writeFileSync(join(prefix, 'site.conf'), text);
    writeFileSync(
      join(prefix, 'nginx.conf'),
      `daemon off; master_process off; worker_processes 1; pid ${prefix}/pid; error_log ${prefix}/error.log;
       events { worker_connections 1024; }
       http { include /etc/nginx/mime.types; default_type application/octet-stream; log_format asked '$request_uri $status';
         client_body_temp_path ${prefix}/b; proxy_temp_path ${prefix}/p; fastcgi_temp_path ${prefix}/f; uwsgi_temp_path ${prefix}/u;
         scgi_temp_path ${prefix}/s; include ${prefix}/site.conf; }\n`,
    );
    const child = spawn(this.options.nginx, ['-p', prefix, '-c', join(prefix, 'nginx.conf')], { stdio: ['ignore', 'inherit', 'inherit'] });
    this.#children.push(child);
    const address = `http://127.0.0.1:${port}/`;
    await until(async () => {
      check(child.exitCode === null, `nginx ended; see ${prefix}/error.log`);
      return (await fetch(`${address}${Object.keys(this.options.sites)[0]}/`).catch(() => null))?.ok;
    }, `nginx as ${name} to answer`);
    return address;
  }
  async origin() {
    this.originPort = await freePort();
    return this.start('origin', this.originPort, [['/srv/tandem', join(this.root, 'site')]]);
  }
  async cache() {
    mkdirSync(join(this.root, 'cached'));
    return this.start('cache', await freePort(), [
      ['127.0.0.1:8080', `127.0.0.1:${this.originPort}`],
      [/\/var\/cache\/nginx/g, join(this.root, 'cached')],
    ]);
  }
  /** The requests that reached the origin, with their status. */
  asked() {
    const text = readFileSync(join(this.root, 'origin', 'access.log'), 'utf8');
    return text.trim().split('\n').map((line) => line.split(' '));
  }

  close() {
    for (const child of this.#children) child.kill('SIGKILL');
    rmSync(this.root, { recursive: true, force: true });
  }
}
