"""Copy the client into the folders of the hosts, which are installed one by one.

python hosts/copy_client.py
"""

import shutil
from pathlib import Path

HERE = Path(__file__).resolve().parent
CLIENT = HERE / "gso_client.py"
COPIES = [HERE / folder / CLIENT.name for folder in ("rhino", "freecad", "blender/gso")]

if __name__ == "__main__":
    for copy in COPIES:
        shutil.copy(CLIENT, copy)
