// Starts `osimlite lsp` for models, setups and tables of OpenSim, and hands everything else to it.
'use strict';

const vscode = require('vscode');
const {LanguageClient, TransportKind} = require('vscode-languageclient/node');

let client;

/** The program and its arguments that the settings name. */
function server(settings) {
  const [command, ...args] = settings.get('command');
  return {command, args, transport: TransportKind.stdio};
}

async function start() {
  const settings = vscode.workspace.getConfiguration('osimlite');
  const options = {
    // Of XML that is not OpenSim's the server says nothing.
    documentSelector: [{language: 'osim'}, {language: 'osim-table'}, {language: 'xml', scheme: 'file'}],
    synchronize: {
      fileEvents: vscode.workspace.createFileSystemWatcher(
        '**/{pyproject.toml,osimlite.toml,*.osim,*.xml,*.omoco,*.sto,*.mot,*.trc}',
      ),
    },
  };
  client = new LanguageClient('osimlite', 'osimlite', server(settings), options);
  try {
    await client.start();
  } catch (error) {
    const wanted = settings.get('command').join(' ');
    vscode.window.showErrorMessage(
      `osimlite: '${wanted}' does not start (${error.message}). In a clone of osimlite run: pip install -e '.[lsp]', and name the ` +
        'program in the setting osimlite.command',
    );
  }
}

async function stop() {
  const running = client;
  client = undefined;
  if (running?.isRunning()) {
    await running.stop();
  }
}

async function activate(context) {
  context.subscriptions.push(
    vscode.commands.registerCommand('osimlite.restart', async () => {
      await stop();
      await start();
    }),
    vscode.workspace.onDidChangeConfiguration(async (event) => {
      if (event.affectsConfiguration('osimlite.command')) {
        await stop();
        await start();
      }
    }),
  );
  await start();
}

module.exports = {activate, deactivate: stop};
