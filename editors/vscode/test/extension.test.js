// The extension as it is shipped, with a stand-in for the editor: does it start the server that the settings name?
'use strict';

const assert = require('node:assert/strict');
const Module = require('node:module');
const {spawnSync} = require('node:child_process');
const path = require('node:path');
const test = require('node:test');

const root = path.join(__dirname, '..');
const manifest = require(path.join(root, 'package.json'));

/** Loads the built extension, with what it asks of the editor and of the language client noted down. */
function load(command, failure) {
  const noted = {started: [], stopped: 0, errors: [], commands: {}};
  const vscode = {
    workspace: {
      getConfiguration: (section) => ({get: (key) => (section === 'osimlite' && key === 'command' ? command : undefined)}),
      createFileSystemWatcher: (pattern) => ({pattern}),
      onDidChangeConfiguration: () => ({dispose() {}}),
    },
    window: {showErrorMessage: (message) => noted.errors.push(message)},
    commands: {registerCommand: (name, run) => ((noted.commands[name] = run), {dispose() {}})},
  };
  class LanguageClient {
    constructor(id, name, server, options) {
      Object.assign(this, {server, options});
    }
    async start() {
      if (failure) throw new Error(failure);
      noted.started.push(this);
    }
    isRunning() {
      return true;
    }
    async stop() {
      noted.stopped += 1;
    }
  }
  const stubs = {vscode, 'vscode-languageclient/node': {LanguageClient, TransportKind: {stdio: 0}}};
  const plain = Module._load;
  Module._load = (request, ...rest) => stubs[request] ?? plain(request, ...rest);
  const file = path.join(root, 'src', 'extension.js');
  delete require.cache[file];
  const extension = require(file);
  Module._load = plain;
  return {extension, noted};
}

test('the settings say what is started, and a restart starts it again', async () => {
  const {extension, noted} = load(['python', '-m', 'osimlite', 'lsp']);
  await extension.activate({subscriptions: []});
  const [client] = noted.started;
  assert.equal(client.server.command, 'python');
  assert.deepEqual(client.server.args, ['-m', 'osimlite', 'lsp']);
  const languages = client.options.documentSelector.map((item) => item.language);
  assert.deepEqual(languages, [...manifest.contributes.languages.map((item) => item.id), 'xml']);
  assert.deepEqual(manifest.activationEvents, ['onLanguage:xml']);
  await noted.commands['osimlite.restart']();
  assert.deepEqual([noted.started.length, noted.stopped], [2, 1]);
  await extension.deactivate();
  assert.equal(noted.stopped, 2);
});

test('a server that is not there is named, with what to do', async () => {
  const {extension, noted} = load(['nowhere'], 'spawn nowhere ENOENT');
  await extension.activate({subscriptions: []});
  assert.match(noted.errors[0], /'nowhere' does not start .*pip install -e '\.\[lsp\]'/);
});

test('every file that the manifest names is there, and the commands are registered', async () => {
  const fs = require('node:fs');
  const {contributes, main} = manifest;
  for (const file of [main, contributes.languages[0].configuration, contributes.grammars[0].path]) {
    assert.ok(fs.existsSync(path.join(root, file)), file);
  }
  const {extension, noted} = load(['osimlite', 'lsp']);
  await extension.activate({subscriptions: []});
  assert.deepEqual(Object.keys(noted.commands), contributes.commands.map((item) => item.command));
});

test('the default command speaks the protocol', {skip: spawnSync('osimlite', ['--version']).status !== 0 && 'osimlite is not installed'}, () => {
  const [command, ...args] = manifest.contributes.configuration.properties['osimlite.command'].default;
  const message = (body) => `Content-Length: ${Buffer.byteLength(body)}\r\n\r\n${body}`;
  const ask = {jsonrpc: '2.0', id: 1, method: 'initialize', params: {processId: null, rootUri: null, capabilities: {}}};
  const input = message(JSON.stringify(ask)) + message('{"jsonrpc":"2.0","method":"exit"}');
  const {stdout} = spawnSync(command, args, {input, encoding: 'utf8', timeout: 30000});
  const {result} = JSON.parse(stdout.slice(stdout.indexOf('{')));
  assert.equal(result.serverInfo.name, 'osimlite');
  for (const feature of ['hoverProvider', 'completionProvider', 'renameProvider', 'documentFormattingProvider']) {
    assert.ok(result.capabilities[feature], feature);
  }
});
